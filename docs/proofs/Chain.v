(* The chain rule: if the move of the head of p would close a circle of full places, the head of the circle's last place
   wants the same place, and its move closes none. So somebody can move for ever without any circle. *)
Require Import Model.

Section Chain.
Context `{R : roads}.
Hypothesis wide : forall p, 2 <= slots p.

(* what a move leaves as it was: fullness but of two places, heads but of the place left *)
Lemma after_move p q D E : possible D -> wants D p q -> move p D E ->
  q <> p /\ ~ full D q /\ ~ full E p /\
  (forall r, r <> q -> full E r -> full D r) /\
  (forall r x, r <> p -> full E r -> (wants E r x <-> wants D r x)).
Proof.
  intros P W (s & line & Dp & Room & Ep & Eq & Rest).
  assert (q = place (next s)) as ->.
  { destruct W as (t & H & <-). unfold head in H. rewrite Dp in H. injection H as ->. auto. }
  assert (Q := wants_other _ _ _ P W).
  assert (NF : ~ full E p).
  { unfold full. rewrite Ep. destruct (P p) as [L _]. rewrite Dp in L. simpl in L. lia. }
  split; [auto|split; [auto|split; [auto|split]]].
  - intros r Nq F. unfold full in *. destruct (Nat.eq_dec r p) as [->|Np]; [contradiction|]. rewrite Rest in F; auto.
  - intros r x Np F. assert (H : head E r = head D r).
    { destruct (Nat.eq_dec r (place (next s))) as [->|Nq]; unfold head; [|rewrite Rest; auto].
      rewrite Eq. unfold full in F. rewrite Eq, app_length in F. simpl in F.
      specialize (wide (place (next s))). destruct (D (place (next s))); simpl in *; [lia|auto]. }
    unfold wants. rewrite H. tauto.
Qed.

(* what the heads lead to from q, q included *)
Inductive ahead (D : config) (q : nat) : nat -> Prop :=
| here : ahead D q q
| on r x : ahead D q r -> wants D r x -> ahead D q x.

Lemma jam_has_ahead C (D : config) q r : jam C D -> C q -> ahead D q r -> C r.
Proof.
  intros J Cq A. induction A as [|r x A IH W]; auto.
  destruct J as [_ All]. destruct (All r IH) as [_ (y & W2 & Cy)]. rewrite (wants_one _ _ _ _ W W2). auto.
Qed.

(* a jam that a move made has the place that it filled *)
Lemma new_jam p q (D E : config) C : possible D -> ~ jammed D -> wants D p q -> move p D E -> jam C E -> C q.
Proof.
  intros P N W M [Some All]. destruct (after_move p q D E P W M) as (Q & Room & NFp & Fu & He).
  apply NNPP. intro Nq. apply N. exists C. split; auto. intros r Cr. destruct (All r Cr) as [F (x & Wx & Cx)].
  assert (r <> q) by (intro; subst; auto). assert (r <> p) by (intro; subst; auto).
  split; [apply Fu; auto|]. exists x. split; auto. apply He; auto.
Qed.

Theorem last_of_circle_moves p q (D E : config) :
  possible D -> ~ jammed D -> wants D p q -> move p D E -> jammed E ->
  exists z, z <> p /\ full D z /\ wants D z q /\ ahead E q z /\ forall G, move z D G -> ~ jammed G.
Proof.
  intros P N W M [C J]. destruct (after_move p q D E P W M) as (Q & Room & NFp & Fu & He).
  assert (Cq := new_jam p q D E C P N W M J).
  assert (FA : forall r, ahead E q r -> full E r) by (intros r A; apply J; eapply jam_has_ahead; eauto).
  assert (Z : exists z, ahead E q z /\ wants E z q).
  { apply NNPP. intro H. apply N. exists (fun r => ahead E q r /\ r <> q). destruct J as [_ All]. split.
    - destruct (All q Cq) as [_ (x & Wx & _)]. exists x. split; [eapply on; eauto; constructor|].
      apply (wants_other E q); auto. apply (move_possible p D); auto.
    - intros r [A Nq]. assert (r <> p) by (intro; subst; apply NFp; auto).
      split; [apply Fu; auto|]. destruct (All r (jam_has_ahead C E q r (conj (ex_intro _ q Cq) All) Cq A)) as [_ (x & Wx & _)].
      exists x. split; [apply He; auto|]. split; [eapply on; eauto|]. intro; subst x. apply H. eauto. }
  destruct Z as (z & Az & Wz).
  assert (Zp : z <> p) by (intro; subst; apply NFp; auto).
  assert (Zq : z <> q) by (intro; subst; apply (wants_other E q q); auto; apply (move_possible p D); auto).
  assert (WD : wants D z q) by (apply (He z q Zp); auto).
  exists z. split; [auto|split; [apply Fu; auto|split; [auto|split; [auto|]]]]. intros G MG [C2 J2].
  destruct (after_move z q D G P WD MG) as (_ & _ & NFz & Fu2 & He2).
  assert (Cq2 := new_jam z q D G C2 P N WD MG J2).
  assert (H : forall r, ahead E q r -> C2 r).
  { destruct J2 as [_ All]. intros r A. induction A as [|r x A Cr Wx]; auto.
    destruct (All r Cr) as [F (y & Wy & Cy)].
    assert (r <> z) by (intro; subst; auto). assert (r <> p) by (intro; subst; apply NFp; apply FA; auto).
    assert (y = x); [|subst; auto]. apply (wants_one D r); [apply He2|apply He]; auto. }
  apply NFz. destruct J2 as [_ All]. apply All; auto.
Qed.
End Chain.
Print Assumptions last_of_circle_moves.
