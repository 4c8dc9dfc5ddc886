//! The driver of the light controller on a serial port.
