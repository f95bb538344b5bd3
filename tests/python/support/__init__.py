"""What tests share: generators, oracles, and programs that tests run in processes of their own."""
