# exit: 4
# expect: no_such_file.cls: error: cannot open: No such file or directory
post
no_such_file.cls
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
