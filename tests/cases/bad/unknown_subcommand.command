# exit: 2
# expect: error: trunnion model has no command 'dignose'; did you mean 'diagnose'?
model
dignose
