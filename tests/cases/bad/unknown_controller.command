# exit: 4
# expect: no_such_controller.toml: error: cannot open: No such file or directory
post
@GOOD@
-m
@MACHINES@/paper.toml
-c
no_such_controller.toml
-o
@OUT@/output.nc
