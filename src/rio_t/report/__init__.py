"""Report of one run: plots as PNG files and one self-contained report.html.

Reads the folder that rio_t_bag writes. Figures in the tables come from its summary.yaml and from the program
`evaluate`; this script only draws.
"""
