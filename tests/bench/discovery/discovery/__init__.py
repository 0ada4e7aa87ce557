"""Independent benchmark of `trunnion model diagnose`. Shares no code with the program: see ../README.md."""
