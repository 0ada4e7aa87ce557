# exit: 2
# expect: error: --tolerance-mm 1e-12 is below half a digit of the words, 5e-05 mm
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
-o
@OUT@/output.nc
--tolerance-mm
1e-12
