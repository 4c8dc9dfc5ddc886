//! The rakelight command line.

fn main() {}
