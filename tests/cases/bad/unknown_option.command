# exit: 2
# expect: error: trunnion post has no option --tolerence-mm; did you mean '--tolerance-mm'?
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--tolerence-mm
1
