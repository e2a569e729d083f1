"""What studies of experiments share: estimates, claims with verdicts, tables, figures, pages."""
