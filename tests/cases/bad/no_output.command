# exit: 2
# expect: error: trunnion post needs
# expect:   -o,--output  NC file (- is standard output)
post
@GOOD@
-m
@MACHINES@/paper.toml
