# exit: 2
# expect: error: trunnion has no command 'posst'; did you mean 'post'?
posst
@GOOD@
