"""Studies of the methods' limits and costs. Imported by no command but theirs."""
