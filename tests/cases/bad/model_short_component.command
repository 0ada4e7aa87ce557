# expect: ../models/short_component.toml:5:1: error: component B is not carried by axis A
# exit: 3
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
--model
../models/short_component.toml
-o
@OUT@/output.nc
