"""Reports for people who decide: one page of HTML and a PDF of the same content, from the folder of a result."""
