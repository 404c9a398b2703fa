"""Cases that an earlier state of sealtwin answered wrongly, run in that state and in this one."""
