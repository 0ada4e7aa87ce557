# exit: 3
# expect: ../tiny_lintol.cls:3:1: error: LINTOL: 1e-12 mm is below half a digit of the words, 5e-05 mm
post
../tiny_lintol.cls
-m
@MACHINES@/trunnion_offset.toml
-o
@OUT@/output.nc
