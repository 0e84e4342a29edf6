//! The `endowire` command.

fn main() {}
