# exit: 2
# expect: error: --tolerance-mm: 0 is not above 0
study
nonlinear
@GOOD@
-m
@MACHINES@/paper.toml
--tolerance-mm
0.01,0
