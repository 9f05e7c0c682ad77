"""Where each method fails: every study drives one to where it breaks and says what the tool does about it."""
