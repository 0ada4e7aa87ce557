# exit: 3
# expect: no_motion.cls:4: error: no motion (GOTO) in the file
study
nonlinear
no_motion.cls
-m
@MACHINES@/paper.toml
--json
@OUT@/study.json
