# expect: ../models/no_table.txt:1:1: error: column 1 is neither an axis of the machine (X_mm, A_deg) nor an error component (EXX_um, EAX_urad)
# never: secret
# exit: 3
post
@GOOD@
-m
@MACHINES@/trunnion_offset.toml
--model
../models/no_table.toml
-o
@OUT@/output.nc
