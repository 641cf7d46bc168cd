from ikns.warm_up import compiled_before, warm_up


def test_everything_is_compiled_with_progress_and_then_at_hand():
    said = []
    first = warm_up(lambda *progress: said.append(progress))
    again = warm_up()
    assert said[0] == ("compiling", 0, said[0][2])
    assert [done for _, done, _ in said] == list(range(said[0][2] + 1))
    assert first > 0
    # Compiled code stays in memory; nothing is loaded again.
    assert again < first
    assert compiled_before()
