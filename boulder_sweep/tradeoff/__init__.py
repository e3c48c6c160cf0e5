"""Speed against accuracy, measured on a user's own grid."""
