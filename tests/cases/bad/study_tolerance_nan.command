# exit: 2
# expect: error: --tolerance-mm: nan is not a number
study
nonlinear
@GOOD@
-m
@MACHINES@/paper.toml
--tolerance-mm
nan
