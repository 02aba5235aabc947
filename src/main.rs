//! The `tusche` command: arguments in, exit code out.

fn main() {}
