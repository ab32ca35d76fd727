"""The mount model: a chain of stages from deformation to thrust share.

deformation_mm -> [deformation effects] -> input curve -> linear block -> output curve
               -> [gain effects] -> [force effects] -> force_N
"""
