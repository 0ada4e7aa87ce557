# expect: ../models/assignment.toml:7:1: error: formula "k = 5", character 3: '=' assigns; a formula compares with '=='
# exit: 3
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
--model
../models/assignment.toml
-o
@OUT@/output.nc
