# exit: 4
# expect: no_such_machine.toml: error: cannot open: No such file or directory
post
@GOOD@
-m
no_such_machine.toml
-o
@OUT@/output.nc
