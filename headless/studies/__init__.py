"""Studies of the program's methods: one folder each, run by ``seip study NAME``. No other module imports them."""
