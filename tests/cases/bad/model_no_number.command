# expect: ../models/no_number.toml:7:1: error: effect 'user:nod' gives no number at any of 8 positions within the travel
# exit: 3
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
--model
../models/no_number.toml
-o
@OUT@/output.nc
