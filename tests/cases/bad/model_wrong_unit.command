# expect: ../models/wrong_unit.toml:6:1: error: 'sin_urad' is 1e+07, beyond what any machine has (1e+05): is it in another unit?
# exit: 3
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
--model
../models/wrong_unit.toml
-o
@OUT@/output.nc
