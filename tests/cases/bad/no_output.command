# exit: 2
# expect: --output is required
post
@GOOD@
-m
@MACHINES@/paper.toml
