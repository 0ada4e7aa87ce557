# exit: 1
# expect: error: nothing written (--accept-deviation writes it all the same)
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
