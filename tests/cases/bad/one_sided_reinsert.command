# exit: 2
# expect: error: --one-sided belongs to --nonlinear adaptive
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--nonlinear
reinsert
--one-sided
