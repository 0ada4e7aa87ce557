# exit: 2
# expect: A subcommand is required
