# exit: 3
# expect: ../comma.nci:1:1: error: NCI: a line with one code is needed
post
../comma.nci
-m
@MACHINES@/trunnion_offset.toml
-o
@OUT@/output.nc
