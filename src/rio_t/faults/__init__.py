"""The fault campaign: each case puts a fault into a bag (or does something to the live node), runs the real pipeline on
it, and checks what must happen. Prints a table; exit status 1 if a case fails.

The bags: a simulated walk of a minute, and the real bag, if $RIO_T_DATA_DIR (default ../shared/data) has it. With
--bag and --config the same faults go into a bag of yours instead; without ground truth, a run on the
unchanged bag stands for the truth. src/rio_t/faults holds the faults (injection.py), the cases with what must happen (cases.py)
and the judges.
"""
