# exit: 1
# expect: error: no file written; to write it anyway: --accept-deviation
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--tolerance-mm
0.0001
--nonlinear
none
