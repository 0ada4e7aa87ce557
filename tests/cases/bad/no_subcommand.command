# exit: 2
# expect: Usage: trunnion [OPTIONS] SUBCOMMAND
