# exit: 4
# expect: no_such_model.toml: error: cannot open: No such file or directory
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--model
no_such_model.toml
