"""Answers of independent libraries."""
