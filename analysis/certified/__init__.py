"""Problems with certified answers, and how many digits of them a program finds."""
