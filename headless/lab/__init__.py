"""Studies of the methods themselves: where they fail, and what they cost. Imported by no command but theirs."""
