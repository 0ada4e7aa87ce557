# exit: 4
# expect: @OUT@/no_such_folder/output.nc: error: cannot write: No such file or directory
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/no_such_folder/output.nc
