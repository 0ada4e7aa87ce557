# exit: 2
# expect: --tolerance-mm: two is not a number
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--tolerance-mm
two
