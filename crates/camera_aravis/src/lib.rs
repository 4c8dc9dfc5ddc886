//! The driver of GenICam cameras, through Aravis.
