# expect: ../models/decimal_comma.toml:7:1: error: formula "0,5 * k", character 2: ',' only divides what a function takes; decimals have a point
# exit: 3
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
--model
../models/decimal_comma.toml
-o
@OUT@/output.nc
