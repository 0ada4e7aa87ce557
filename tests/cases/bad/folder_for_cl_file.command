# exit: 4
# expect: ..: error: is a folder, not a file
post
..
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
