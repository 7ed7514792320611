//! The command line of servobee.

fn main() {}
