-- Declarations of options.
---
softvt.options {
  n = { default = 1, min = 3,
    max = 2 } }
