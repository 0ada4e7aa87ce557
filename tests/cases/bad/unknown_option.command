# exit: 2
# expect: The following arguments were not expected: 1 --tolerence-mm
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--tolerence-mm
1
