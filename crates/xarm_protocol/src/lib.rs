//! What goes over the wire between the xArm's controller and its clients.
