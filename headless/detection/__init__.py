"""Detection of road users in merged clouds, and how well it is done."""
