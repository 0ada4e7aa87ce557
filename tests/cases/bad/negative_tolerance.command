# exit: 2
# expect: error: --tolerance-mm: -1 is not above 0
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--tolerance-mm
-1
