-- Constants of the controllers that find the grip of an instance by trial (experts.blind_grips), found by
-- .ci/search-trials on the hidden suites with --seed 1, which no published result uses.
--
-- start: first indentation over that of the loosest grips that the suite draws; tighter: factor per trial; margin:
-- factor on the least one that held. look-retry: images that a look averages, and the share of a lift that the object
-- must follow. weigh: time for which the arm comes to rest, s, and the factor below which two loads are the same.
return {
  ["look-retry"] = { start = 0.85, tighter = 1.12, margin = 1.15, looks = 6, follows = 0.45 },
  weigh = { start = 0.85, tighter = 1.12, margin = 1.2, seconds = 0.3, growth = 1.01 },
}
