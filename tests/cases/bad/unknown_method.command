# exit: 2
# expect: error: --nonlinear: magic not in {none,reinsert,subtract,adaptive}
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--nonlinear
magic
