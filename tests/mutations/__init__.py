"""Files that people write, spoilt at random: each is read or refused, soon and in little memory.

    PYTHONPATH=tests python -m mutations --count 100000 --seed 1 [--kind machine] [--command]

`grammar.py` spoils the tokens of a good file: numbers, words, texts, marks, whole lines.
`inputs.py` has the good files of each kind and reads a spoilt one. Whatever is no
`TrueposeError`, takes more than `SECONDS` or more than `MEMORY` is a failure, and is printed
with the seed and number that make it again.
"""
