//! The firmware: its hardware-free part on this computer, and the real program on a simulated microcontroller.

mod build;
mod portable;
mod simulated;
mod simulation;
