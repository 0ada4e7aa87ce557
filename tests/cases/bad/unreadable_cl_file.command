# exit: 4
# expect: /proc/self/mem: error: cannot read: Input/output error
post
/proc/self/mem
-m
@MACHINES@/trunnion_offset.toml
-o
@OUT@/output.nc
