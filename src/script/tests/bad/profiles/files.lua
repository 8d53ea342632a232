-- Files that declare no profile.
---
return {}

return softvt.profile {
  nam = 'mine',
}
