"""The report on a localized drive."""
