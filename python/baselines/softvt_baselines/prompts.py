"""Prompts as hashed n-grams of words: paraphrases share most of them, and `left` and `right` differ."""

import re
import zlib

# Number of buckets, and of n-grams that are kept of a prompt. Bucket 0 is padding.
BUCKETS, LENGTH = 4096, 64


def words(prompt: str) -> list[str]:
    return re.findall(r"[a-z0-9]+", prompt.lower())


def ngrams(prompt: str) -> list[str]:
    """Words and pairs of neighbouring words."""
    single = words(prompt)
    return single + [" ".join(pair) for pair in zip(single, single[1:])]


def bucket(ngram: str) -> int:
    return 1 + zlib.crc32(ngram.encode()) % (BUCKETS - 1)


def encode(prompt: str) -> list[int]:
    """Buckets of a prompt, padded to LENGTH."""
    found = [bucket(ngram) for ngram in ngrams(prompt)][:LENGTH]
    return found + [0] * (LENGTH - len(found))


class Vocabulary:
    """Words of the prompts that a policy was trained with."""

    # Share of the words of a prompt that must have been trained.
    LEAST = 0.5

    def __init__(self, prompts: list[str]):
        self.prompts = sorted(set(prompts))
        self.known = {word for prompt in self.prompts for word in words(prompt)}

    def problem(self, prompt: str) -> str | None:
        """Why the policy cannot follow a prompt; None if it can."""
        own = words(prompt)
        unknown = [word for word in own if word not in self.known]
        if own and len(own) - len(unknown) >= self.LEAST * len(own):
            return None
        return (
            f"the policy was not trained for the prompt {prompt!r}: it does not know {', '.join(unknown) or 'an empty prompt'}; "
            f"it was trained with {len(self.prompts)} prompts like {self.prompts[0]!r}"
        )
