def test_it_registers(add_on):
    pass
