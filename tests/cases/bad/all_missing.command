# exit: 2
# expect: error: trunnion post needs
# expect:   part          CL file, or NC program with --from (- is standard input)
# expect:   -o,--output   NC file (- is standard output)
# expect:   -m,--machine  machine file, or the name of one in postconfigs/machines
post
