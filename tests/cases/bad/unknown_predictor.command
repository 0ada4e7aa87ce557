# exit: 2
# expect: error: --predictor: 'harmonic99' is no predictor
post
@GOOD@
-m
@MACHINES@/paper.toml
-o
@OUT@/output.nc
--predictor
harmonic99
