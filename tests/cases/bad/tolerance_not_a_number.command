# exit: 2
# expect: error: --tolerance-mm: two is not a number
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--tolerance-mm
two
